var v=class extends Error{constructor(e,t){super(t),this.code=e}};var y=()=>performance.now()/1e3;var T=(o="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${o}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,P=`
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
in vec3 painted;
uniform float cutoff;
out vec4 shown;
${P}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured){
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=0.25+0.75*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
sampled=vec4(1.0);
}
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
void main(){shown=vec4(bytes(item),0.0,1.0);}`,O={surface:[T(),W],item:[T(),K],placeholder:[T(),j]};function L(o,e,t=O[e]){let s=o.createProgram(),r=[o.VERTEX_SHADER,o.FRAGMENT_SHADER];if(t.forEach((h,c)=>{let a=o.createShader(r[c]);o.shaderSource(a,h),o.compileShader(a),o.attachShader(s,a),o.deleteShader(a)}),o.linkProgram(s),!o.getProgramParameter(s,o.LINK_STATUS)&&!o.isContextLost())throw new Error(`${e}: ${o.getProgramInfoLog(s)}`);let n={},i=o.isContextLost()?0:o.getProgramParameter(s,o.ACTIVE_UNIFORMS);for(let h=0;h<i;h++){let c=o.getActiveUniform(s,h)?.name??"";n[c]=o.getUniformLocation(s,c)}return{program:s,at:n}}function F(o,{program:e,at:t},s){o.useProgram(e),o.uniform3fv(t.eye,s.eye),o.uniformMatrix3fv(t.turn,!1,s.turn),o.uniform4fv(t.lens,s.lens)}function N(o,e,t,s=0,r=s){let n=0;for(let i=0;i<3;i++){let h=Math.max(e[s+i]-o[i],o[i]-t[r+i],0);n+=h*h}return Math.sqrt(n)}var Y=[.5,.7,.6].map(o=>o/Math.hypot(.5,.7,.6)),X=`
float lit(vec3 normal) {
  float along = (1.0 + dot(normal, vec3(${Y.join()}))) / 2.0;
  return ${.3} + ${1-.3} * along * along;
}`;var Z=Uint32Array.from({length:256},(o,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function C(o,e=0){let t=~e;for(let s=0;s<o.length;s++)t=Z[(t^o[s])&255]^t>>>8;return~t>>>0}var f=4096,z=2**24,J=7,Q=65536,ee=new Uint8Array([3,0]),q=2,te=4;function d(o,e){if(!o)throw new Error(e)}var U=(o,e,t)=>Number.isInteger(o)&&e<=o&&o<=t;function B({cube:o,levels:e,streams:t}){let s=r=>typeof r=="number"&&Math.abs(r)<=1e15;d(Array.isArray(o?.low)&&o.low.length===3&&o.low.every(s),"no cube"),d(s(o.side)&&o.side>=1e-15,"no cube"),d(Array.isArray(e)&&U(e.length,1,21),"no levels"),d(e.every(r=>U(r,1,z)),"a level without texels"),d(e.reduce((r,n)=>r+n,0)<=z,"too many texels");for(let r of t){for(let n of[r?.ends,r?.crc32])d(Array.isArray(n)&&n.length===e.length,"lists of other lengths"),d(n.every(i=>U(i,0,4294967295)),"a list without numbers");d(r.ends.every((n,i)=>n>(i?r.ends[i-1]:q)),"ends that do not ascend")}}var se=64,re=10,V=o=>typeof o?.code=="string"&&o.code.startsWith("PTM-V"),S=class{rows=0;constructor(e,t){this.gl=e;let s=Math.max(1,Math.ceil(t/f));this.size=4*f*s,this.bytes=new Uint8Array(this.size),this.texture=e.createTexture(),this.#e(()=>{e.texStorage2D(e.TEXTURE_2D,1,e.RGBA8UI,f,s);for(let r of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(e.TEXTURE_2D,r,e.NEAREST)})}#e(e){let{gl:t}=this;t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,this.texture),e(),t.activeTexture(t.TEXTURE0)}upload(e){let{gl:t,bytes:s,rows:r}=this;if(!s)return!0;let n=Math.ceil(e/f),i=Math.min(n,r+se);return this.#e(()=>t.texSubImage2D(t.TEXTURE_2D,0,0,r,f,i-r,t.RGBA_INTEGER,t.UNSIGNED_BYTE,s,4*f*r)),this.rows=Math.min(i,Math.floor(e/f)),i===n}},A=class{#e=[0,0];#t=0;#s=!1;#r=[];constructor(e,t,s,r,n){this.gl=e,this.index=t,this.urlOf=s,this.fetcher=r,this.step=n,this.starts=[0];for(let i of t.levels)this.starts.push((this.starts.at(-1)??0)+i);if(this.count=this.starts.at(-1),e.getParameter(e.MAX_TEXTURE_SIZE)<f)throw new v("PTM-V101","This graphics card has no textures of 4,096 texels.");this.streams=t.streams,this.texels=this.streams.map(()=>new S(e,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0}get complete(){return this.levels===this.index.levels.length}delete(){this.#s=!0;for(let{texture:e}of this.texels)this.gl.deleteTexture(e)}get bytes(){return this.texels.reduce((e,{size:t})=>e+t,0)}get rests(){return y()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((e,{ends:t})=>e+t[this.levels-1],0):0}advance(e,t,s){this.running||this.complete||this.rests||!e(this.levels)||(this.running=!0,this.#o().then(()=>s?.(),r=>{this.restsUntil=r.code==="PTM-V104"?y()+re:1/0,this.#s||t(r)}).finally(()=>this.running=!1))}async#o(){let e=this.index.levels.length,t=this.levels?this.levels+1:Math.min(J,e),s=this.step&&this.levels?setInterval(()=>this.#i(),1e3*this.step):0;try{await Promise.all(this.streams.map((r,n)=>this.#n(n,this.levels,t)))}finally{clearInterval(s),this.partial=!1}for(let r of this.texels)for(;!this.#s&&!r.upload(this.starts[t]);)await new Promise(n=>setTimeout(n,16));if(!this.#s&&(this.updates++,this.levels=t,this.complete))for(let r of this.texels)r.bytes=null}#i(){let e=Math.min(...this.#e.slice(0,this.streams.length));if(!(this.#s||e<=Math.max(this.#t,this.starts[this.levels]))){for(let t of this.texels)for(;!t.upload(e););this.#t=e,this.updates++,this.partial=!0}}async#n(e,t,s){try{await this.#a(e,t,s,"default")}catch(r){if(V(r))throw r;this.#r[e]=null,await this.#a(e,t,s,"no-store").catch(n=>{throw V(n)?n:new v("PTM-V105",`${this.streams[e].file} is damaged: ${n.message}`)})}}async#a(e,t,s,r){let n=this.streams[e],i=this.texels[e],h=i.bytes,c=t?n.ends[t-1]:q,a=n.ends[s-1]-(s===n.ends.length?te:0),u=new DecompressionStream("deflate-raw"),m=u.writable.getWriter(),x=4*this.starts[s],p=new Map,w=4*this.starts[t],g=t;i.rows=Math.min(i.rows,Math.floor(this.starts[t]/f)),this.#e[e]=this.#t=this.starts[t];let E=(async()=>{for(let l=u.readable.getReader();;){let{done:I,value:b}=await l.read();if(I)return;d(w+b.length<=x,"more texels than the index says"),h.set(b,w);for(let M=0;M<b.length;){let D=4*this.starts[g+1]-w,R=b.subarray(M,M+D);p.set(g,C(R,p.get(g))),M+=R.length,w+=R.length,R.length===D&&g++}this.#e[e]=Math.floor(w/4)}})();E.catch(()=>{});let k=this.step&&t?Q:a-c;for(let l=c;l<a;l+=k){let I=await this.#c(e,l,Math.min(l+k,a),r);await Promise.race([m.write(I),E])}s<n.ends.length&&await Promise.race([m.write(ee),E]),await Promise.all([m.close(),E]),d(w===x,"fewer texels than the index says");for(let l=t;l<s;l++)d(p.get(l)===n.crc32[l],`level ${l} has another checksum`)}async#c(e,t,s,r){let{file:n,ends:i}=this.streams[e],h=i.at(-1),c=this.#r[e];if(!c){let a=await this.fetcher.range(this.urlOf(n),t,s,h,void 0,r);if(a.begin===t&&a.body.length===s-t)return a.body;c=this.#r[e]=a.body}return c.subarray(t,s)}};var H=`
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
}`;var G=128<<20,oe=.1,ne=T(`
uniform vec3 low;
uniform float side;
out vec3 q;`,"q = (position - low) / side;"),ie=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in vec3 seen;
in vec2 uv;
in vec3 painted;
in vec3 q;
uniform float cutoff;
out vec4 shown;
${P}
${H}
${X}
void main(){
int stop=stopDepth(q);
vec4 sampled=textured?texel():vec4(1.0);
vec3 normal=normalize(vec3(texel(octree,addressAt(q,stop)).rgb)/127.5-1.0);
shown=vec4(sampled.rgb*color.rgb*painted*lit(normal),sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
shown.a=1.0;
}`,$=class{#e=[];#t=new Map;#s=!1;#r=[];constructor(e,t,s,r,n,i){this.gl=e,this.site=s,this.fetcher=r,this.report=n,this.touch=i,this.indices=t.map(h=>{try{let{cube:c,levels:a,file:u,ends:m,crc32:x}=h,p={cube:c,levels:a,streams:[{file:u,ends:m,crc32:x}]};return B(p),p}catch(c){return n(new v("PTM-V105",`The index has a wrong octree: ${c.message}`)),null}}),this.program=L(e,"octree",[ne,ie])}delete(){for(let e of this.#e)e?.delete();this.#e=[]}has({octree:e}){return(this.#e[e]?.levels??0)>0}get lacks(){return!this.#s||[...this.#t.keys()].some(e=>this.#i(e))}get levels(){return Array.from(this.#e,e=>e?.levels??0)}get bytes(){return this.#e.reduce((e,t)=>e+(t?.bytes??0),0)}advance(e,t,s,r){this.#t.clear(),this.#s=!0;let n=y();for(let{batches:c}of e)for(let{look:{octree:a,blends:u},low:m,high:x}of c){let p=this.indices[a];if(!p||u)continue;let w=Math.max(oe,N(t,m,x)),g=s/2/w*p.cube.side;this.#t.set(a,Math.max(g,this.#t.get(a)??0)),this.#r[a]=n}if(!r||this.#e.some(c=>c?.running))return;let i=-1,h=0;for(let c of this.#t.keys()){let a=this.#o(c);a>h&&this.#i(c)&&([i,h]=[c,a])}i>=0&&this.#c(i)}#o(e){let t=this.#e[e]?.levels??0;return(this.#t.get(e)??0)*2**-Math.max(0,t-1)}#i(e){let t=this.#e[e];return t?!t.complete&&!t.rests&&this.#o(e)>1:this.#o(e)>1&&this.#a(e)}#n(e){return 4*(this.indices[e]?.levels.reduce((t,s)=>t+s,0)??0)}#a(e){return[...this.#t.keys()].filter(s=>s!==e&&this.#e[s]).reduce((s,r)=>s+this.#n(r),this.#n(e))<=G}#c(e){let t=this.#e[e],s=this.indices[e];s&&(t||(this.#h(this.#n(e)),t=new A(this.gl,s,r=>this.site.of(r),this.fetcher,0),this.#e[e]=t),t.advance(()=>!0,this.report,this.touch))}#h(e){let t=[...this.#e.keys()].filter(s=>this.#e[s]&&!this.#t.has(s));for(let s of t.sort((r,n)=>this.#r[r]-this.#r[n])){if(this.bytes+e<=G)return;this.#e[s]?.delete(),delete this.#e[s]}}draw(e,t,s){let{gl:r,program:n}=this,{at:i}=n;F(r,n,e),r.uniform1i(i.octree,1);let h=!1;for(let{buffers:c,batch:a}of t){let u=this.#e[a.look.octree],{cube:{low:m,side:x}}=u.index;r.activeTexture(r.TEXTURE1),r.bindTexture(r.TEXTURE_2D,u.texels[0].texture),r.activeTexture(r.TEXTURE0),r.uniform3fv(i.low,m),r.uniform1f(i.side,x),r.uniform1i(i.texels,u.count),r.uniform1i(i.deepest,u.levels-1),r.uniform1i(i.partial,0),r.bindVertexArray(c.vertexArray),h=s(i,a)||h,c.draw(a)}return h}};var ke=(o,e)=>new $(o.gl,o.index.octrees??[],o.site,o.fetcher,e,()=>o.touch());export{ke as statuesOf};
