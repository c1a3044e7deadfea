var T=class extends Error{constructor(e,t){super(t),this.code=e}};var de=6,me=.5,C=20,P=class extends Error{constructor(e,t=!1){super(e),this.anew=t}},I=()=>performance.now()/1e3,D=class{constructor(e){this.notice=e,this.measured=null,this.requests=0,this.bytes=0,this.pending=0,this.ignoresRanges=!1}whole(e,t,s,r="default"){return this.#t(e,r,s,async o=>{let{response:c,body:i}=await this.#s(e,{cache:o},s);if(c.status!==200)throw W(e,c.status);try{return await t(i)}catch(a){if(a instanceof T)throw a;let l=a.message;throw o==="default"?new P(l,!0):new T("PTM-V105",`${V(e)} is damaged: ${l}`)}})}range(e,t,s,r,o,c="default"){let i=`bytes=${t}-${s-1}`;return this.#t(e,c,o,async a=>{let{response:l,body:h}=await this.#s(e,{cache:a,headers:{range:i}},o);if(l.status===200){if(h.length!==r)throw new P(`${h.length} of ${r} bytes`,!0);return this.#e(),{begin:0,body:h}}if(l.status!==206)throw W(e,l.status);let f=l.headers.get("content-range")??`bytes ${t}-${s-1}/${r}`;if(f!==`bytes ${t}-${s-1}/${r}`||h.length!==s-t)throw new P(`${h.length} bytes, "${f}", in place of ${i}`,!0);return{begin:t,body:h}})}#e(){this.ignoresRanges||(this.ignoresRanges=!0,console.warn("This host ignores byte ranges: each texture is downloaded whole before it is seen."),this.notice("Textures load slowly here: the server does not support range requests."))}async#t(e,t,s,r){let o=s?.left??0,c="";for(let i=0;i<de;i++){i&&(s&&Object.assign(s,{left:0,waits:!0}),await we(me*2**(i-1))),s&&Object.assign(s,{left:o,waits:!1}),this.pending++;try{return await r(t)}catch(a){if(a instanceof T)throw a;a instanceof P&&a.anew&&(t="no-store"),c=String(a.message)}finally{this.pending--}}throw new T("PTM-V104",`${V(e)} cannot be downloaded: ${c}`)}async#s(e,t,s){this.requests++;let r=new AbortController,o=new P(`nothing came for ${C} s`),c=setTimeout(()=>r.abort(o),1e3*C);try{let i=I(),a=await fetch(e,{...t,signal:r.signal}),l=I(),h=a.body?.getReader(),f=[];for(;;){let{done:u,value:y}=await h?.read()??{done:!0,value:void 0};if(u||!y){let m=pe(f);return this.measured?.(i,l,I(),m.length),{response:a,body:m}}clearTimeout(c),c=setTimeout(()=>r.abort(o),1e3*C),f.push(y),this.bytes+=y.length,s&&(s.left-=y.length)}}finally{clearTimeout(c)}}};function pe(n){let e=new Uint8Array(n.reduce((s,{length:r})=>s+r,0)),t=0;for(let s of n)e.set(s,t),t+=s.length;return e}function W(n,e){if(e>=500||e===429||e===408)return new P(`status ${e}`);let t=e===404?"is missing":`is refused with status ${e}`;return new T("PTM-V103",`${V(n)} ${t} on this site`)}function V(n){return decodeURIComponent(new URL(n,location.href).pathname.split("/").pop()??n)}function we(n){return new Promise(e=>{let t=()=>{clearTimeout(s),removeEventListener("online",t),e(void 0)},s=setTimeout(t,1e3*n);addEventListener("online",t)})}var xe=Uint32Array.from({length:256},(n,e)=>{for(let t=0;t<8;t++)e=e&1?e>>>1^3988292384:e>>>1;return e});function F(n,e=0){let t=~e;for(let s=0;s<n.length;s++)t=xe[(t^n[s])&255]^t>>>8;return~t>>>0}var A=4096,G=2**24,ve=7,ye=65536,ge=new Uint8Array([3,0]),K=2,Ee=4;function d(n,e){if(!n)throw new Error(e)}var U=(n,e,t)=>Number.isInteger(n)&&e<=n&&n<=t;function j({cube:n,levels:e,streams:t}){let s=r=>typeof r=="number"&&Math.abs(r)<=1e15;d(Array.isArray(n?.low)&&n.low.length===3&&n.low.every(s),"no cube"),d(s(n.side)&&n.side>=1e-15,"no cube"),d(Array.isArray(e)&&U(e.length,1,21),"no levels"),d(e.every(r=>U(r,1,G)),"a level without texels"),d(e.reduce((r,o)=>r+o,0)<=G,"too many texels");for(let r of t){for(let o of[r?.ends,r?.crc32])d(Array.isArray(o)&&o.length===e.length,"lists of other lengths"),d(o.every(c=>U(c,0,4294967295)),"a list without numbers");d(r.ends.every((o,c)=>o>(c?r.ends[c-1]:K)),"ends that do not ascend")}}var Te=64,be=10,Y=n=>typeof n?.code=="string"&&n.code.startsWith("PTM-V"),z=class{rows=0;constructor(e,t){this.gl=e;let s=Math.max(1,Math.ceil(t/A));this.size=4*A*s,this.bytes=new Uint8Array(this.size),this.texture=e.createTexture(),this.#e(()=>{e.texStorage2D(e.TEXTURE_2D,1,e.RGBA8UI,A,s);for(let r of[e.TEXTURE_MIN_FILTER,e.TEXTURE_MAG_FILTER])e.texParameteri(e.TEXTURE_2D,r,e.NEAREST)})}#e(e){let{gl:t}=this;t.activeTexture(t.TEXTURE1),t.bindTexture(t.TEXTURE_2D,this.texture),e(),t.activeTexture(t.TEXTURE0)}upload(e){let{gl:t,bytes:s,rows:r}=this;if(!s)return!0;let o=Math.ceil(e/A),c=Math.min(o,r+Te);return this.#e(()=>t.texSubImage2D(t.TEXTURE_2D,0,0,r,A,c-r,t.RGBA_INTEGER,t.UNSIGNED_BYTE,s,4*A*r)),this.rows=Math.min(c,Math.floor(e/A)),c===o}},L=class{#e=[0,0];#t=0;#s=!1;#n=[];constructor(e,t,s,r,o){this.gl=e,this.index=t,this.urlOf=s,this.fetcher=r,this.step=o,this.starts=[0];for(let c of t.levels)this.starts.push((this.starts.at(-1)??0)+c);if(this.count=this.starts.at(-1),e.getParameter(e.MAX_TEXTURE_SIZE)<A)throw new T("PTM-V101","This graphics card has no textures of 4,096 texels.");this.streams=t.streams,this.texels=this.streams.map(()=>new z(e,this.count)),this.levels=0,this.partial=!1,this.updates=0,this.running=!1,this.restsUntil=0}get complete(){return this.levels===this.index.levels.length}delete(){this.#s=!0;for(let{texture:e}of this.texels)this.gl.deleteTexture(e)}get bytes(){return this.texels.reduce((e,{size:t})=>e+t,0)}get rests(){return I()<this.restsUntil}get fetched(){return this.levels?this.streams.reduce((e,{ends:t})=>e+t[this.levels-1],0):0}advance(e,t,s){this.running||this.complete||this.rests||!e(this.levels)||(this.running=!0,this.#r().then(()=>s?.(),r=>{this.restsUntil=r.code==="PTM-V104"?I()+be:1/0,this.#s||t(r)}).finally(()=>this.running=!1))}async#r(){let e=this.index.levels.length,t=this.levels?this.levels+1:Math.min(ve,e),s=this.step&&this.levels?setInterval(()=>this.#o(),1e3*this.step):0;try{await Promise.all(this.streams.map((r,o)=>this.#a(o,this.levels,t)))}finally{clearInterval(s),this.partial=!1}for(let r of this.texels)for(;!this.#s&&!r.upload(this.starts[t]);)await new Promise(o=>setTimeout(o,16));if(!this.#s&&(this.updates++,this.levels=t,this.complete))for(let r of this.texels)r.bytes=null}#o(){let e=Math.min(...this.#e.slice(0,this.streams.length));if(!(this.#s||e<=Math.max(this.#t,this.starts[this.levels]))){for(let t of this.texels)for(;!t.upload(e););this.#t=e,this.updates++,this.partial=!0}}async#a(e,t,s){try{await this.#i(e,t,s,"default")}catch(r){if(Y(r))throw r;this.#n[e]=null,await this.#i(e,t,s,"no-store").catch(o=>{throw Y(o)?o:new T("PTM-V105",`${this.streams[e].file} is damaged: ${o.message}`)})}}async#i(e,t,s,r){let o=this.streams[e],c=this.texels[e],i=c.bytes,a=t?o.ends[t-1]:K,l=o.ends[s-1]-(s===o.ends.length?Ee:0),h=new DecompressionStream("deflate-raw"),f=h.writable.getWriter(),u=4*this.starts[s],y=new Map,m=4*this.starts[t],x=t;c.rows=Math.min(c.rows,Math.floor(this.starts[t]/A)),this.#e[e]=this.#t=this.starts[t];let g=(async()=>{for(let p=h.readable.getReader();;){let{done:R,value:b}=await p.read();if(R)return;d(m+b.length<=u,"more texels than the index says"),i.set(b,m);for(let E=0;E<b.length;){let w=4*this.starts[x+1]-m,v=b.subarray(E,E+w);y.set(x,F(v,y.get(x))),E+=v.length,m+=v.length,v.length===w&&x++}this.#e[e]=Math.floor(m/4)}})();g.catch(()=>{});let S=this.step&&t?ye:l-a;for(let p=a;p<l;p+=S){let R=await this.#c(e,p,Math.min(p+S,l),r);await Promise.race([f.write(R),g])}s<o.ends.length&&await Promise.race([f.write(ge),g]),await Promise.all([f.close(),g]),d(m===u,"fewer texels than the index says");for(let p=t;p<s;p++)d(y.get(p)===o.crc32[p],`level ${p} has another checksum`)}async#c(e,t,s,r){let{file:o,ends:c}=this.streams[e],i=c.at(-1),a=this.#n[e];if(!a){let l=await this.fetcher.range(this.urlOf(o),t,s,i,void 0,r);if(l.begin===t&&l.body.length===s-t)return l.body;a=this.#n[e]=l.body}return a.subarray(t,s)}};function M(n,e){let t=n.querySelector(e);if(!t)throw new Error(`the page has no ${e}`);return t}function J(n,e={},...t){let s=document.createElement(n);for(let[r,o]of Object.entries(e))r in s?Reflect.set(s,r,o):s.setAttribute(r,o);return s.append(...t),s}function X(n){let e=n<1e6?["kB",1e3]:["MB",1e6],t=n/Number(e[1]);return`${t.toFixed(t<10?1:0)} ${e[0]}`}var Z="Tell the owner of this site: publishing it again should repair it.",Q="Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer",Me={"PTM-V101":`${Q}, with hardware acceleration on.`,"PTM-V102":`${Q}.`,"PTM-V103":Z,"PTM-V104":"Check your connection and reload the page.","PTM-V106":"Update the browser, or allow this page to use web workers and more memory.","PTM-V105":Z},Re="Reload the page. If that does not help, tell the owner of this site.",ee=8e3,Ae=["nav","#panels","#view"];function te(n,{code:e,message:t}){let s=M(n,"#error"),r=M(n,"#again");M(n,"#error-text").textContent=t,M(n,"#error-remedy").textContent=Me[e]??Re,M(n,"#error-code").textContent=e,M(n,"#loading").hidden=!0,s.hidden=!1;for(let o of Ae)M(n,o).inert=!0;r.onclick=()=>location.reload(),r.focus()}function N(n,...e){let t=J("p",{},...e);M(n,"#notices").append(t);let s=()=>{t.contains(n.activeElement)?setTimeout(s,ee):t.remove()};setTimeout(s,ee)}async function se(n){let e=!1,t=s=>{e=!0;let r=s instanceof T;te(document,r?s:new T("PTM-V107",String(s)))};try{let s=M(document,"canvas"),r=JSON.parse(M(document,"#site").textContent??""),o=s.getContext("webgl2",{antialias:!0,preserveDrawingBuffer:!1});if(!o)throw new T("PTM-V101","This browser cannot draw with WebGL 2.");s.addEventListener("webglcontextlost",f=>{f.preventDefault(),t(new T("PTM-V107","The graphics card has reset the page."))});let c=new D(f=>N(document,f)),i=await n(o,r,c,t);Object.assign(window,{ptm:i});let a=M(document,"#status"),l=I(),h=()=>{if(e)return;let f=I();try{Ie(s);let u=i.frame(Math.min(f-l,.1));a.textContent!==u&&(a.textContent=u)}catch(u){throw t(u),u}l=f,requestAnimationFrame(h)};requestAnimationFrame(h),document.body.classList.add("begun")}catch(s){t(s)}}function Ie(n){let e=Math.max(1,Math.round(n.clientWidth*devicePixelRatio)),t=Math.max(1,Math.round(n.clientHeight*devicePixelRatio));(n.width!==e||n.height!==t)&&Object.assign(n,{width:e,height:t})}function ne(n,e,t){return n.whole(e,s=>t(JSON.parse(new TextDecoder("utf-8",{fatal:!0}).decode(s))))}var q=(n="",e="")=>`#version 300 es
precision highp float;
uniform vec3 eye;
uniform mat3 turn;
uniform vec4 lens;
layout(location=0)in vec3 position;
layout(location=1)in vec2 place;
layout(location=2)in vec4 paint;
out vec3 seen;
out vec2 uv;
out vec3 painted;${n}
void main(){
${e}
painted=paint.rgb;
seen=turn*(position-eye);
uv=place;
gl_Position=vec4(seen.xy*lens.xy,seen.z*lens.z+lens.w,-seen.z);
}`,Se=`
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
}`,Pe=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
in vec2 spot;
in vec3 painted;
uniform float cutoff;
uniform sampler2D lightmap;
uniform float lit;
out vec4 shown;
${Se}
void main(){
vec4 sampled=texel();
float light=1.0;
if(!textured)sampled=vec4(1.0);
if(lit !=0.0){
light=1.055*pow(lit < 0.0?texture(lightmap,spot).r:lit,1.0/2.4)-0.055;
}else if(!textured){
vec3 normal=cross(dFdx(seen),dFdy(seen));
float size=length(normal);
light=0.25+0.75*(size > 0.0?abs(dot(normal,normalize(seen)))/size:1.0);
}
shown=vec4(sampled.rgb*color.rgb*painted*light,sampled.a*color.a);
if(shown.a < max(cutoff,0.004))discard;
if(cutoff > 0.0)shown.a=1.0;
}`,oe=`
vec2 bytes(float number) {
  float high = floor(number / 256.0);
  return vec2(number - 256.0 * high, high) / 255.0;
}`,Ue=`#version 300 es
precision highp float;
in vec3 seen;
in vec2 uv;
uniform float item;
uniform vec2 size;
uniform float pixels;
out vec4 shown;
${oe}
void main(){
float w=gl_FragCoord.w;
vec2 texels=uv*size;
vec2 across=(dFdx(texels*w)-texels*dFdx(w))/w;
vec2 up=(dFdy(texels*w)-texels*dFdy(w))/w;
float most=max(dot(across,across),dot(up,up));
float detail=0.5*log2(max(most,1e-30))-log2(pixels);
shown=vec4(bytes(item),bytes(floor(256.0*clamp(detail,0.0,31.0))));
}`,$e=`#version 300 es
precision highp float;
uniform float item;
layout(location=1)out vec4 shown;
${oe}
void main(){shown=vec4(bytes(item),0.0,1.0);}`,re={surface:[q(`
layout(location = 3) in vec2 place2;
out vec2 spot;`,"spot = place2;"),Pe],item:[q(),Ue],placeholder:[q(),$e]};function ie(n,e,t=re[e]){let s=n.createProgram(),r=[n.VERTEX_SHADER,n.FRAGMENT_SHADER];if(t.forEach((i,a)=>{let l=n.createShader(r[a]);n.shaderSource(l,i),n.compileShader(l),n.attachShader(s,l),n.deleteShader(l)}),n.linkProgram(s),!n.getProgramParameter(s,n.LINK_STATUS)&&!n.isContextLost())throw new Error(`${e}: ${n.getProgramInfoLog(s)}`);let o={},c=n.isContextLost()?0:n.getProgramParameter(s,n.ACTIVE_UNIFORMS);for(let i=0;i<c;i++){let a=n.getActiveUniform(s,i)?.name??"";o[a]=n.getUniformLocation(s,a)}return{program:s,at:o}}var ae=`
uniform usampler2D octree;
uniform int texels,deepest;
uniform bool partial;
uvec4 texel(usampler2D of,int address){
return texelFetch(of,ivec2(address % ${A},address/${A}),0);
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
}`;var De=.2,Fe=.7,Le=.2,Ne=[-.5,.65,.6],_e=[.8,-.3,.5],ke=[.93,.9,.85],Oe=[58,62,70].map(n=>n/255),Be=`#version 300 es
in vec3 corner;
in vec3 own;
uniform vec3 eye,right,up,ahead;
uniform vec2 lens;
uniform float near;
out highp vec3 q;
out highp vec3 normal;
void main(){
vec3 p=corner-eye;
float z=dot(p,ahead);
q=corner;
normal=own;
gl_Position=vec4(dot(p,right)/lens.x,dot(p,up)/lens.y,z-2.0*near,z);
}`,Ce=`#version 300 es
precision highp float;
precision highp int;
precision highp usampler2D;
in highp vec3 q;
in highp vec3 normal;
uniform usampler2D colors;
uniform bool colored,bare;
uniform vec3 key,fill,stone;
out vec4 shown;
${ae}
void main(){
int stop=stopDepth(q);
vec3 n=normal;
vec3 color=stone;
if(deepest >=0){
int address=addressAt(q,stop);
n=vec3(texel(octree,address).rgb)/127.5-1.0;
if(colored)color=vec3(texel(colors,address).rgb)/255.0;
}
n=normalize(n);
float light=${De}+${Fe}*max(dot(n,key),0.0)+${Le}*max(dot(n,fill),0.0);
shown=vec4(bare?n*0.5+0.5:min(color*light,1.0),1.0);
}`;function ce(n,e){d(F(n)===e,"another checksum");let t=new DataView(n.buffer,n.byteOffset,n.length);d(n.length>=28&&t.getUint32(0,!0)===1179937895,"not a GLB");let s=t.getUint32(12,!0),r=20+s+8;d(r<=n.length,"a chunk that leads out of the file");let{bufferViews:o,accessors:c}=JSON.parse(new TextDecoder().decode(n.subarray(20,20+s))),i=n.slice(r),a=(x,g,S)=>{let p=c[x].count*S,R=o[x].byteOffset??0;return d(U(p,1,2**31)&&U(R,0,i.length),"an impossible accessor"),d(R+p*g.BYTES_PER_ELEMENT<=i.length,"an accessor that leads out of its bytes"),new g(i.buffer,R,p)},l=a(0,Float32Array,3),h=a(1,Float32Array,3),f={5123:Uint16Array,5125:Uint32Array}[c[2].componentType];d(f&&h.length===l.length,"arrays that do not match");let u=a(2,f,1);d(l.every(Number.isFinite)&&h.every(Number.isFinite),"a number that is not finite"),d(u.every(x=>x<l.length/3),"an index out of range");let y=[1/0,1/0,1/0],m=[-1/0,-1/0,-1/0];return l.forEach((x,g)=>{y[g%3]=Math.min(y[g%3],x),m[g%3]=Math.max(m[g%3],x)}),{positions:l,normals:h,indices:u,low:y,high:m}}var _=class{constructor(e,{positions:t,normals:s,indices:r,low:o,high:c},{low:i,side:a}){this.gl=e,this.use=ie(e,"octree",[Be,Ce]),this.cube={corner:i,side:a},this.radius=Math.hypot(...c.map((h,f)=>h-o[f]))/a/2,this.count=r.length,this.type=r instanceof Uint16Array?e.UNSIGNED_SHORT:e.UNSIGNED_INT,this.array=e.createVertexArray(),e.bindVertexArray(this.array);let l=t.map((h,f)=>(h-i[f%3])/a);for(let[h,f]of[["corner",l],["own",s]]){let u=e.getAttribLocation(this.use.program,h);e.bindBuffer(e.ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ARRAY_BUFFER,f,e.STATIC_DRAW),e.enableVertexAttribArray(u),e.vertexAttribPointer(u,3,e.FLOAT,!1,0,0)}e.bindBuffer(e.ELEMENT_ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ELEMENT_ARRAY_BUFFER,r,e.STATIC_DRAW)}draw(e,t,{bare:s,levels:r}){let{gl:o,use:{program:c,at:i},cube:{corner:a,side:l}}=this,{right:h,up:f,ahead:u,half:y}=t,m=t.away/l;o.viewport(0,0,o.drawingBufferWidth,o.drawingBufferHeight);let[x,g,S]=s?[0,0,0]:Oe;o.clearColor(x,g,S,1),o.clear(o.COLOR_BUFFER_BIT|o.DEPTH_BUFFER_BIT),o.enable(o.DEPTH_TEST),o.useProgram(c),o.bindVertexArray(this.array),e.texels.forEach(({texture:b},E)=>{o.activeTexture(o.TEXTURE0+E),o.bindTexture(o.TEXTURE_2D,b)});let p=Math.min(e.levels,r)-1,R=e.texels.length>1;o.uniform1i(i.octree,0),o.uniform1i(i.colors,R?1:0),o.uniform1i(i.texels,e.count),o.uniform1i(i.deepest,p),o.uniform1i(i.partial,Number(e.partial&&e.levels<r)),o.uniform1i(i.colored,Number(R)),o.uniform1i(i.bare,Number(s)),o.uniform3fv(i.eye,t.eye.map((b,E)=>(b-a[E])/l));for(let[b,E]of Object.entries({right:h,up:f,ahead:u}))o.uniform3fv(i[b],E);o.uniform2fv(i.lens,y),o.uniform1f(i.near,Math.max(m-this.radius,m/64)/2);for(let[b,E]of Object.entries({key:Ne,fill:_e})){let w=h.map((v,$)=>E[0]*h[$]+E[1]*f[$]-E[2]*u[$]);o.uniform3fv(i[b],w.map(v=>v/Math.hypot(...w)))}o.uniform3fv(i.stone,ke),o.drawElements(o.TRIANGLES,this.count,this.type,0)}pixels(e,t,s){let r=Math.max(s.away/this.cube.side-this.radius,1e-6);return t/(2*s.half[1]*r)*2**-e}};var he=35*Math.PI/180,le=.4,k=60,Ve=.0015,ze=.05,Xe=20,fe={ArrowLeft:[-k,0,0],ArrowRight:[k,0,0],ArrowUp:[0,k,0],ArrowDown:[0,-k,0],Equal:[0,0,-1],NumpadAdd:[0,0,-1],Minus:[0,0,1],NumpadSubtract:[0,0,1]},O=class{#e=new Set;#t=new Map;constructor(e,t,s){this.canvas=e,this.middle=t,this.diameter=s,this.azimuth=25,this.elevation=15,this.distance=0;let[r,o,c=0]=location.hash.slice(1).split(",").map(Number);[r,o,c].every(Number.isFinite)&&this.place(r,o,c),e.focus({preventScroll:!0}),e.addEventListener("pointerdown",i=>{i.button===0&&(e.setPointerCapture(i.pointerId),this.#t.set(i.pointerId,{x:i.clientX,y:i.clientY}))});for(let i of["pointerup","pointercancel"])e.addEventListener(i,a=>this.#t.delete(a.pointerId));e.addEventListener("pointermove",i=>this.#r(i)),e.addEventListener("wheel",i=>{i.preventDefault(),this.#n(Math.exp(i.deltaY*Ve))},{passive:!1}),e.addEventListener("keydown",i=>{if(i.ctrlKey||i.metaKey||i.altKey)return this.#e.clear();i.code in fe&&(i.preventDefault(),this.#e.add(i.code))}),e.addEventListener("keyup",i=>this.#e.delete(i.code)),e.addEventListener("blur",()=>this.#e.clear())}place(e,t,s=0){this.azimuth=e%360,this.elevation=Math.max(-90,Math.min(90,t)),this.distance=s>0?Math.max(ze,Math.min(Xe,s)):0}step(e){for(let t of this.#e){let[s,r,o]=fe[t];this.place(this.azimuth+s*e,this.elevation+r*e,this.distance),o&&this.#n(Math.exp(o*e))}}get camera(){let e=this.canvas.width/this.canvas.height,t=Math.tan(he/2),[s,r]=[this.azimuth,this.elevation].map(f=>f*Math.PI/180),o=[Math.sin(s)*Math.cos(r),Math.sin(r),Math.cos(s)*Math.cos(r)],c=(this.distance||this.#s(e,t))*this.diameter,i=this.middle.map((f,u)=>f+c*o[u]),a=o.map(f=>-f),l=Math.hypot(a[0],a[2]),h=l<1e-9?[1,0,0]:[-a[2]/l,0,a[0]/l];return{eye:i,right:h,up:qe(h,a),ahead:a,away:c,half:[t*e,t]}}#s(e,t){return .5/Math.sin(Math.atan(t*Math.min(1,e)))}#n(e){let{width:t,height:s}=this.canvas,r=this.distance||this.#s(t/s,Math.tan(he/2));this.place(this.azimuth,this.elevation,r*e)}#r(e){let t=this.#t.get(e.pointerId);if(!t)return;let s=this.#o(),r={x:e.clientX,y:e.clientY};if(this.#t.set(e.pointerId,r),this.#t.size===1){let[o,c]=[r.x-t.x,r.y-t.y];this.place(this.azimuth-o*le,this.elevation+c*le,this.distance)}else s>0&&this.#o()>0&&this.#n(s/this.#o())}#o(){let[e,t]=this.#t.values();return e&&t?Math.hypot(e.x-t.x,e.y-t.y):0}},qe=(n,e)=>[n[1]*e[2]-n[2]*e[1],n[2]*e[0]-n[0]*e[2],n[0]*e[1]-n[1]*e[0]];function He(n){d(n?.format==="ptmtools apo"&&n.schema===1,"not an index of an octree texture");let{cube:e,levels:t,normals:s,colors:r,mesh:o}=n;d(s?.file==="apo.bin"&&(r??{file:"color.bin"}).file==="color.bin","other streams");let c={cube:e,levels:t,streams:r?[s,r]:[s]};return j(c),d(o?.file==="mesh.glb"&&U(o.crc32,0,4294967295),"no mesh"),{...c,mesh:o}}se(async(n,e,t,s)=>{let r=new URLSearchParams(location.search),o=new URL(e.index,location.href).href,c=w=>new URL(w,o).href,i=await ne(t,o,He),a=await t.whole(c(i.mesh.file),w=>ce(w,i.mesh.crc32)),l=r.get("update")==="steps"?Math.max(.05,Number(r.get("step"))||.5):0,h=new L(n,i,c,t,l),f=new _(n,a,i.cube),u=n.canvas,y=a.low.map((w,v)=>(w+a.high[v])/2),m=new O(u,y,Math.hypot(...a.high.map((w,v)=>w-a.low[v]))),x=r.has("levels")?Math.max(0,Number(r.get("levels"))||0):1/0,g=r.has("normals"),S=i.streams.reduce((w,{ends:v})=>w+(v.at(-1)??0),0),p=!1,R="",b=0,E=w=>h.levels?N(document,w.message):s(w);return M(document,"#keys").textContent="Drag or use the arrow keys to turn; wheel, two fingers, + and − to zoom",{frame(w){m.step(w);let{camera:v}=m,$=B=>B<x&&(!B||f.pixels(B-1,u.height,v)>1);h.advance($,E),p=!h.complete&&!$(h.levels);let H=[u.width,u.height,...v.eye,h.updates,h.partial].join();H!==R&&f.draw(h,v,{bare:g,levels:x}),R=H,b=h.levels;let ue=h.complete||h.levels>=x?"":p?"; finer ones when you come closer":" …";return`${h.levels} of ${i.levels.length} levels, ${X(h.fetched)} of ${X(S)}${ue}`},state:()=>({levels:h.levels,partial:h.partial,complete:h.complete&&b===h.levels,paused:p,updates:h.updates,requests:t.requests,bytes:t.bytes,pending:t.pending,camera:m.camera}),place:m.place.bind(m)}});
