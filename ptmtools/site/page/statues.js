var v=class extends Error{constructor(t,e){super(e),this.code=t}};var y=()=>performance.now()/1e3;var T=(r="",t="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${r}
void main(){
${t}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,I=`
uniform sampler2D map;
uniform int channels;
uniform vec4 color;
uniform vec3 mean;
uniform bool textured;
vec4 texel(){
vec4 sampled=texture(map,uv);
if(channels==1)sampled=vec4(sampled.rrr,1.0);
if(channels==2)sampled=sampled.rrrg;
return channels==0?vec4(mean,1.0):sampled;
}`,W=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${I}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
sampled=vec4(1.0);
float glow=lit !=0.0?0.7:0.25;
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=glow+(1.0-glow)*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
if(lit !=0.0)light*=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,_=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,K=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${_}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,j=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${_}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,O={surface:[T(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),W],item:[T(),K],placeholder:[T(),j]};function L(r,t,e=O[t]){let s=r.createProgram(),o=[r.VERTEX_SHADER,r.FRAGMENT_SHADER];if(e.forEach((h,c)=>{let a=r.createShader(o[c]);r.shaderSource(a,h),r.compileShader(a),r.attachShader(s,a),r.deleteShader(a)}),r.linkProgram(s),!r.getProgramParameter(s,r.LINK_STATUS)&&!r.isContextLost())throw new Error(`${t}: ${r.getProgramInfoLog(s)}`);let i={},n=r.isContextLost()?0:r.getProgramParameter(s,r.ACTIVE_UNIFORMS);for(let h=0;h<n;h++){let c=r.getActiveUniform(s,h)?.name??"";i[c]=r.getUniformLocation(s,c)}return{program:s,at:i}}function F(r,{program:t,at:e},s){r.useProgram(t),r.uniform3fv(e.eye,s.eye),r.uniformMatrix3fv(e.turn,!1,s.turn),r.uniform4fv(e.lens,s.lens)}function N(r,t,e,s=0,o=s){let i=0;for(let n=0;n<3;n++){let h=Math.max(t[s+n]-r[n],r[n]-e[o+n],0);i+=h*h}return Math.sqrt(i)}var Y=[.5,.7,.6].map(r=>r/Math.hypot(.5,.7,.6)),X=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${Y.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;var Z=Uint32Array.from({length:256},(r,t)=>{for(let e=0;e<8;e++)t=t&1?t>>>1^3988292384:t>>>1;return t});function C(r,t=0){let e=~t;for(let s=0;s<r.length;s++)e=Z[(e^r[s])&255]^e>>>8;return~e>>>0}var f=4096,z=2**24,J=7,Q=65536,tt=new Uint8Array([3,0]),q=2,et=4;function d(r,t){if(!r)throw new Error(t)}var P=(r,t,e)=>Number.isInteger(r)&&t<=r&&r<=e;function B({cube:r,levels:t,streams:e}){let s=o=>typeof o=="number"&&Math.abs(o)<=1e15;d(Array.isArray(r?.low)&&r.low.length===3&&r.low.every(s),"no cube"),d(s(r.side)&&r.side>=1e-15,"no cube"),d(Array.isArray(t)&&P(t.length,1,21),"no levels"),d(t.every(o=>P(o,1,z)),"a level without texels"),d(t.reduce((o,i)=>o+i,0)<=z,"too many texels");for(let o of e){for(let i of[o?.ends,o?.crc32])d(Array.isArray(i)&&i.length===t.length,"lists of other lengths"),d(i.every(n=>P(n,0,4294967295)),"a list without numbers");d(o.ends.every((i,n)=>i>(n?o.ends[n-1]:q)),"ends that do not ascend")}}var st=64,ot=10,V=r=>typeof r?.code=="string"&&r.code.startsWith("PTM-V"),U=class{rows=0;constructor(t,e){this.gl=t;let s=Math.max(1,Math.ceil(e/f));this.size=4*f*s,this.bytes=new Uint8Array(this.size),this.texture=t.createTexture(),this.#t(()=>{t.texStorage2D(t.TEXTURE_2D,1,t.RGBA8UI,f,s);for(let o of[t.TEXTURE_MIN_FILTER,t.TEXTURE_MAG_FILTER])t.texParameteri(t.TEXTURE_2D,o,t.NEAREST)})}#t(t){let{gl:e}=this;e.activeTexture(e.TEXTURE1),e.bindTexture(e.TEXTURE_2D,this.texture),t(),e.activeTexture(e.TEXTURE0)}upload(t){let{gl:e,bytes:s,rows:o}=this;if(!s)return!0;let i=Math.ceil(t/f),n=Math.min(i,o+st);return this.#t(()=>e.texSubImage2D(e.TEXTURE_2D,0,0,o,f,n-o,e.RGBA_INTEGER,e.UNSIGNED_BYTE,s,4*f*o)),this.rows=Math.min(n,Math.floor(t/f)),n===i}},A=class{#t=[0,0];#e=0;#s=!1;#o=[];constructor(t,e,s,o,i){this.gl=t,this.index=e,this.urlOf=s,this.fetcher=o,this.step=i,this.starts=[0];for(let n of e.levels)this.starts.push((this.starts.at(-1)??0)+n);if(this.count=this.starts.at(-1),t.getParameter(t.MAX_TEXTURE_SIZE)<f)throw new v("PTM-V101","This graphics card has no textures of 4,096 texels.");this.streams=e.streams,this.texels=this.streams.map(()=>new U(t,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0}get complete(){return this.levels===this.index.levels.length}delete(){this.#s=!0;for(let{texture:t}of this.texels)this.gl.deleteTexture(t)}get bytes(){return this.texels.reduce((t,{size:e})=>t+e,0)}get rests(){return y()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((t,{ends:e})=>t+e[this.levels-1],0):0}advance(t,e,s){this.running||this.complete||this.rests||!t(this.levels)||(this.running=!0,this.#r().then(()=>s?.(),o=>{this.restsUntil=o.code==="PTM-V104"?y()+ot:1/0,this.#s||e(o)}).finally(()=>this.running=!1))}async#r(){let t=this.index.levels.length,e=this.levels?this.levels+1:Math.min(J,t),s=this.step&&this.levels?setInterval(()=>this.#n(),1e3*this.step):0;try{await Promise.all(this.streams.map((o,i)=>this.#i(i,this.levels,e)))}finally{clearInterval(s),this.partial=!1}for(let o of this.texels)for(;!this.#s&&!o.upload(this.starts[e]);)await new Promise(i=>setTimeout(i,16));if(!this.#s&&(this.updates++,this.levels=e,this.complete))for(let o of this.texels)o.bytes=null}#n(){let t=Math.min(...this.#t.slice(0,this.streams.length));if(!(this.#s||t<=Math.max(this.#e,this.starts[this.levels]))){for(let e of this.texels)for(;!e.upload(t););this.#e=t,this.updates++,this.partial=!0}}async#i(t,e,s){try{await this.#a(t,e,s,"default")}catch(o){if(V(o))throw o;this.#o[t]=null,await this.#a(t,e,s,"no-store").catch(i=>{throw V(i)?i:new v("PTM-V105",`${this.streams[t].file} is damaged: ${i.message}`)})}}async#a(t,e,s,o){let i=this.streams[t],n=this.texels[t],h=n.bytes,c=e?i.ends[e-1]:q,a=i.ends[s-1]-(s===i.ends.length?et:0),u=new DecompressionStream("deflate-raw"),m=u.writable.getWriter(),w=4*this.starts[s],p=new Map,x=4*this.starts[e],g=e;n.rows=Math.min(n.rows,Math.floor(this.starts[e]/f)),this.#t[t]=this.#e=this.starts[e];let E=(async()=>{for(let l=u.readable.getReader();;){let{done:k,value:b}=await l.read();if(k)return;d(x+b.length<=w,"more texels than the index says"),h.set(b,x);for(let M=0;M<b.length;){let D=4*this.starts[g+1]-x,R=b.subarray(M,M+D);p.set(g,C(R,p.get(g))),M+=R.length,x+=R.length,R.length===D&&g++}this.#t[t]=Math.floor(x/4)}})();E.catch(()=>{});let S=this.step&&e?Q:a-c;for(let l=c;l<a;l+=S){let k=await this.#c(t,l,Math.min(l+S,a),o);await Promise.race([m.write(k),E])}s<i.ends.length&&await Promise.race([m.write(tt),E]),await Promise.all([m.close(),E]),d(x===w,"fewer texels than the index says");for(let l=e;l<s;l++)d(p.get(l)===i.crc32[l],`level ${l} has another checksum`)}async#c(t,e,s,o){let{file:i,ends:n}=this.streams[t],h=n.at(-1),c=this.#o[t];if(!c){let a=await this.fetcher.range(this.urlOf(i),e,s,h,void 0,o);if(a.begin===e&&a.body.length===s-e)return a.body;c=this.#o[t]=a.body}return c.subarray(e,s)}};var H=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${f},address/${f}),0);
}
int ones(uint mask){
mask-=mask >> 1u & 0x55u;
mask=(mask & 0x33u)+(mask >> 2u & 0x33u);
return int((mask+(mask >> 4u))& 0x0fu);
}
int addressAt(vec3 at,int stop){
at=clamp(at,0.0,0.99999994);
int address=0;
uvec4 here=texel(octree,0);
stop=min(stop,deepest+int(partial));
for(int depth=0; here.a !=0u && depth < stop && address+1 < texels; depth++){
at*=2.0;
bvec3 upper=greaterThanEqual(at,vec3(1.0));
at-=vec3(upper);
uint bit=1u <<(uint(upper.x)+2u*uint(upper.y)+4u*uint(upper.z));
if((here.a & bit)==0u)break;
uvec4 below=texel(octree,address+1);
int next=int(below.r | below.g << 8u | below.b << 16u);
next+=ones(here.a &(bit-1u))+ones(below.a &(bit-1u));
if(next >=texels)break;
uvec4 there=texel(octree,next);
if(partial && depth==deepest && there.rgb==uvec3(0u))break;
address=next;
here=there;
}
return address;
}
int stopDepth(vec3 at){
vec3 dx=dFdx(at),dy=dFdy(at);
return-((floatBitsToInt(min(dot(dx,dx),dot(dy,dy)))>> 23)-127 >> 1);
}`;var G=128<<20,rt=.1,it=T(`
uniform vec3 low;
uniform float side;
out vec3 q;`,"q = (position - low) / side;"),nt=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec3 q;
uniform float cutoff;
out vec4 shown;
${I}
${H}
${X}
void main(){
int stop=stopDepth(q);
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(vec3(texel(octree,addressAt(q,stop)).rgb)/127.5-1.0);
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,$=class{#t=[];#e=new Map;#s=!1;#o=[];constructor(t,e,s,o,i,n){this.gl=t,this.site=s,this.fetcher=o,this.report=i,this.touch=n,this.indices=e.map(h=>{try{let{cube:c,levels:a,file:u,ends:m,crc32:w}=h,p={cube:c,levels:a,streams:[{file:u,ends:m,crc32:w}]};return B(p),p}catch(c){return i(new v("PTM-V105",`The index has a wrong octree: ${c.message}`)),null}}),this.program=L(t,"octree",[it,nt])}delete(){for(let t of this.#t)t?.delete();this.#t=[]}has({octree:t}){return(this.#t[t]?.levels??0)>0}get lacks(){return!this.#s||[...this.#e.keys()].some(t=>this.#n(t))}get levels(){return Array.from(this.#t,t=>t?.levels??0)}get bytes(){return this.#t.reduce((t,e)=>t+(e?.bytes??0),0)}advance(t,e,s,o){this.#e.clear(),this.#s=!0;let i=y();for(let{batches:c}of t)for(let{look:{octree:a,blends:u},low:m,high:w}of c){let p=this.indices[a];if(!p||u)continue;let x=Math.max(rt,N(e,m,w)),g=s/2/x*p.cube.side;this.#e.set(a,Math.max(g,this.#e.get(a)??0)),this.#o[a]=i}if(!o||this.#t.some(c=>c?.running))return;let n=-1,h=0;for(let c of this.#e.keys()){let a=this.#r(c);a>h&&this.#n(c)&&([n,h]=[c,a])}n>=0&&this.#c(n)}#r(t){let e=this.#t[t]?.levels??0;return(this.#e.get(t)??0)*2**-Math.max(0,e-1)}#n(t){let e=this.#t[t];return e?!e.complete&&!e.rests&&this.#r(t)>1:this.#r(t)>1&&this.#a(t)}#i(t){return 4*(this.indices[t]?.levels.reduce((e,s)=>e+s,0)??0)}#a(t){return[...this.#e.keys()].filter(s=>s!==t&&this.#t[s]).reduce((s,o)=>s+this.#i(o),this.#i(t))<=G}#c(t){let e=this.#t[t],s=this.indices[t];s&&(e||(this.#h(this.#i(t)),e=new A(this.gl,s,o=>this.site.of(o),this.fetcher,0),this.#t[t]=e),e.advance(()=>!0,this.report,this.touch))}#h(t){let e=[...this.#t.keys()].filter(s=>this.#t[s]&&!this.#e.has(s));for(let s of e.sort((o,i)=>this.#o[o]-this.#o[i])){if(this.bytes+t<=G)return;this.#t[s]?.delete(),delete this.#t[s]}}draw(t,e,s){let{gl:o,program:i}=this,{at:n}=i;F(o,i,t),o.uniform1i(n.octree,1);let h=!1;for(let{buffers:c,batch:a}of e){let u=this.#t[a.look.octree],{cube:{low:m,side:w}}=u.index;o.activeTexture(o.TEXTURE1),o.bindTexture(o.TEXTURE_2D,u.texels[0].texture),o.activeTexture(o.TEXTURE0),o.uniform3fv(n.low,m),o.uniform1f(n.side,w),o.uniform1i(n.texels,u.count),o.uniform1i(n.deepest,u.levels-1),o.uniform1i(n.partial,0),o.bindVertexArray(c.vertexArray),h=s(n,a)||h,c.draw(a)}return h}};function St(r,t){let{gl:e,index:s,site:o,fetcher:i,renderer:n}=r;n&&(n.statues=new $(e,s.octrees??[],o,i,t,()=>r.touch()))}export{St as show};
